"""Runs matches: asks agents, waits no longer than the deadline, and turns their replies into one joint action."""
