"""MCAP file ↔ messages: all topics of a run in one file, and the file read back.

One channel per key, the payload as it went over the bus, and the JSON schema of each kind of message beside it,
so that Foxglove and every MCAP tool open it. Chunks are compressed with zstd; `Recorder.flush` ends one, so
that a process killed later loses nothing before it. A file without its end is read up to the tear, and a file
with damage up to the damage; `Recording.complete` says which it is, and `recover` writes what is left as a
whole file.

This package knows bytes, keys and kinds of messages, and nothing of matches; when to flush is known above, in
`orchestrator`. Nothing is loaded that was not asked for: a recording of any size is read in the memory of one
chunk. Not safe for threads.
"""

from khala_protocol.recording.reader import Recorded, RecordedStep, Recording, read, recover
from khala_protocol.recording.recorder import Recorder

__all__ = ["Recorded", "RecordedStep", "Recorder", "Recording", "read", "recover"]
