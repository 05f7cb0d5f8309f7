"""How rules reach the memory of a world: by pointers where they are compiled, by views where they are interpreted.

A rule is one Python file. Where a file of the same name with the suffix `.pxd` stands beside it, Cython compiles it:
the `.pxd` gives the types in C of what the rule declares, and imports those that it uses. `memory` and `columns` are
what differs between the two: each is a `.py` for the interpreter and a `.pxd` for the compiler.
"""
