"""A whole design in one TOML file: plan, solver, targets, output."""
