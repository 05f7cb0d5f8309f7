"""Run matches: ask agents, wait until the deadline at most, and turn their replies into one joint action."""
