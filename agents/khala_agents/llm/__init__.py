"""Talking to language models: one small interface, and what answers it.

`client` is the interface with its errors; `openai_compatible` and `anthropic` speak HTTP through `transport`,
`replay` answers from a recording. `retry`, `limits` and `pricing` are independent of who answers. Nothing
here knows the game, the bus or a prompt.
"""
