"""The commands of the command line, one a module; `graspforce.commands.app` puts them together."""
