"""The text actions: what an agent can say, and which function of PySC2 each of them ends in.

action      the model of an entry         catalogue   all of them: by hand and by rule
functions   PySC2's functions as a table  generated   the entries that follow by rule
fault       what makes an entry wrong     coverage    which functions are reached
"""
