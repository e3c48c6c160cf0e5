"""Pictures: they read trajectories and tables and compute no physics. matplotlib (extra ``plot``) is loaded lazily."""
