"""The doors: what every HTTP server of Khala checks before it answers.

    rules      who may ask, and how much: a machine without input or output
    brake      how long a peer waits after wrong tries, likewise
    asgi       the rules around an ASGI application: `khala mcp`, `khala openenv`
    pages      the rules around an aiohttp application: `khala view`, the metrics of `khala serve`
    serving    uvicorn, as it serves them

Below it, `khala_protocol.listening` limits how many connections there are, and how long each may take to say what it
wants. The scripted endpoint of `khala llm` uses it as well; it has rules of its own, for programs alone.

Khala's servers are for programs and pages of their owner. The rules assume that other users of the machine, other
machines, and every page that a browser of this machine shows will try to reach them.
"""
