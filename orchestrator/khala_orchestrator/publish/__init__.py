"""What leaves a match: its recording, its announcements, and the letters of advisers that come in."""
