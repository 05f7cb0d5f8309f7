"""The game as a process: websocket, sessions, lobby, LAN, clock, replays, and the install that clients find."""
