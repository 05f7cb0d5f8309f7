"""Commands of `khala` that have no package of their own, and what all commands share.

run, host      play a match: on this machine, or on an open bus
keys, doctor   API keys; what works on this machine
actions        the actions of a task (`action_list`)
advise         write to agents of a match that is played
options        options that several commands have
help           the help of the command line
exit_codes     what a command ends with

Above: `khala_sc2.cli`. Below: `khala_sc2.playing`.
"""
