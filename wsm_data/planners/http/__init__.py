"""The public HTTP protocol of start-goal and point-goal navigation: what travels, a server and a client."""
