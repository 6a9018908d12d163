"""Pages: HTML from templates with style, script and pictures inside, so that nothing is loaded from elsewhere."""
