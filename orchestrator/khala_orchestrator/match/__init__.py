"""A match that is played: its loop (`match`), and what the loop asks in each step."""
