"""The commands of the command line, one a module; `graspforce.cli.app` puts them together."""
