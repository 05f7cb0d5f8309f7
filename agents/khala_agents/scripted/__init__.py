"""Doubles that ship with Khala: policies and an endpoint that need no model.

`policies` answer in place of a model within a worker. `endpoint` is an HTTP server that speaks OpenAI's chat
completions and plays from the text of the prompt alone (`reading` → `players`), with `faults` on request: whatever
a match meets there, it meets at a real endpoint too.
"""
