"""A headless StarCraft II that speaks the SC2 API to unmodified clients.

It stands alone: it imports no other package of this project, and no other package imports it.
"""

from khala_simulator.native.engine import choose

choose()
