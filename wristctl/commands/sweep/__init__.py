"""A command at many values of its settings."""
