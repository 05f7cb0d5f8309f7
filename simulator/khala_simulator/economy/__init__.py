"""The rules of the economy: harvesting, production, building, power, supply, requirements and payments."""
