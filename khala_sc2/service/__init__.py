"""`khala serve`: matches on order, several at once, each in its own processes, which are ready before it is wanted.

cli        the commands: serve, submit, matches, watch, stop
client     what the commands say to a service, over the bus
daemon     the service: orders in, matches out
book       which matches there are, and whose turn it is; no process, no bus
pool       workers (`khala_sc2.playing.jobs`) that wait for a match
memory     what processes take
metrics    for Prometheus, from the messages of matches
traces     for OpenTelemetry, from the same messages
"""
