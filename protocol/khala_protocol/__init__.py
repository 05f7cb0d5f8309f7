"""What travels on the bus, and nothing else: messages, keys, the text language, the bus, the recording.

Every other package that talks to a peer imports this package; it imports none of them.
"""
