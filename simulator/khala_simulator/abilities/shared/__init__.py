"""What the abilities of several races share: morphing, producing, carrying, building."""
