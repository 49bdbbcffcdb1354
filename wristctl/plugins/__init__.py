"""Code from elsewhere: found, trusted, loaded and hashed."""
