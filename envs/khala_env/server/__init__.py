"""Where OpenEnv looks for the server of an environment."""
