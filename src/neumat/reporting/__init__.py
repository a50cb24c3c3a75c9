"""Tables, charts and figures."""
