"""Time integration: flows, variational equations, events."""
