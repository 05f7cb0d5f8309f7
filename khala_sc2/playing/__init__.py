"""How a match is played from here: its game, its bus, its host and its agents.

local        a match on this machine, each part in a process of its own
one_process  a match in this process, with the agents' policies in it
seats        a match in this process whose agents the caller plays
hosting      the game and the host of a match, on a bus that is open
matches      the match of a task: what its options say
minds        what decides for each agent
games        which game plays
spending     what a match and its experiment may cost
jobs         matches in processes of their own (`worker`), of experiments and of the service
children     processes that are watched, and spare ones (`spare`)
processes    how a process of our code is started, and ended
logs         log lines of processes that play matches, also as JSON
environment  the variables that each process may see
local_bus    the router of a match on this machine
loop_thread  an event loop in a thread, for callers without one

Above: the commands, experiments, services and environments of `khala`. Below: `khala_orchestrator`, `khala_agents`.
"""
