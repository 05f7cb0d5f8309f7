"""Abilities: the rule behind each; `registry` joins the tables of all modules."""
