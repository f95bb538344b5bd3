"""The command line.

- `main`: the entry point; `app`: all commands and their exit codes (`exit_codes`); `command`: wrong values of
  their options.
- `quality`, `forces` (with `trajectory`), `plan` (with `plan_mesh`), `plan_hand`, `shake`, `grade`, `view`,
  `reproduce`, `info`: one command each.
- `grasp_options`: options of a mesh in place of a file; `output`: tables, JSON, pictures; `progress`:
  progress bars.
"""
