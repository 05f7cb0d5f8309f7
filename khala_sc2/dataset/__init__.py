"""Data sets made of recordings: one row for each decision of an agent, and agents that play from them.

    row       what is known of one decision
    rows      a recording → rows, one by one
    dynamics  a recording → observations, joint orders and next observations, for world models
    rewards   what a decision was worth
    prompts   the prompt of a decision, made again where no request to a model was recorded
    choose    which rows are exported, and into which split
    forms     a row → a chat in OpenAI's or ShareGPT's form, or TRL's prompt and completion
    files     rows → JSON Lines and Parquet
    read      these files → prompts and replies; the check that splits share no prompt
    repeats   duplicates, and prompts that several splits would have
    lengths   tokens of each part of a row
    card      the README of a data set
    export    all of it, for the command `khala dataset export`
    replay    a policy that gives the replies of a data set

Above it is `khala_sc2.cli`. Everything is read and written row by row, so the size of recordings does not matter. pyarrow,
the extra `data`, is imported only where Parquet is written or read.
"""
