"""Every task of the catalogue as an evaluation of inspect_ai: `inspect eval khala_sc2/2s3z --model openai/gpt-5`.

    tasks     the tasks, as inspect_ai finds them by the entry point `inspect_ai` of this distribution
    team      the solver: the model plays all agents of a side
    model     requests of ours to a model of inspect_ai
    scores    win, killed and lost value, legality

It needs the extra `inspect`. Below it: `khala_sc2.playing.seats`.
"""
