"""Maps: terrain, scenarios, the scripts of scenarios, and `.SC2Map` archives."""
