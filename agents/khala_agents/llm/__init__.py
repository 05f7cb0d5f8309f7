"""Talk to language models: one small interface, and the clients that implement it.

`client` is the interface with its errors; `openai_compatible`, `responses`, `anthropic` and `gemini` speak HTTP
through `transport`, `replay` answers from a recording. `retry`, `limits` and `pricing` do not depend on the client.
Nothing here knows the game, the bus or a prompt.
"""
