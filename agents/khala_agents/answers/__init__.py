"""The form in which a model must answer: text, one object of JSON, calls of tools, or text that a grammar bounds.

    text      the text language, and nothing holds the model to it
    json      an object that a JSON schema describes, which the endpoint enforces
    tools     a tool for each action, as the endpoint's own function calls
    grammar   the text language, held to by a grammar (GBNF) on llama.cpp and vLLM

`choices` says what an agent can answer, by its briefing and perhaps by one observation; `schema`, `tools` and `grammar`
render it, and `wording` says in the prompt how to answer. Whatever the form, the host reads the words of the model
(`khala_protocol.speech`) and judges them alike. Above: `khala_agents.llm_policy`, and the clients of
`khala_agents.llm`, which send a form as their endpoint wants it.
"""
