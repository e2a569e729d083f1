"""Serving components to runs on other hosts."""
