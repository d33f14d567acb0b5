"""From the command line to a result file: settings, processes, files and provenance."""
