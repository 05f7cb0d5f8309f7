"""What agents write to each other and to themselves: who gets it, what was answered, what is kept."""
