"""What is done with a recording: replay it, resume or fork its match, read it as a transcript, measure its agents."""
