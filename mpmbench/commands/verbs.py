"""Which commands there are, what each takes, and what it does."""

# What each command takes and does. `mpmbench.commands.<name>` is imported on use: its function
# ``main`` takes the remaining arguments and returns the exit code.
VERBS = {
    "list": ("[NAME]", "what there is, or what can be set for one option"),
    "status": ("[FOLDER | FILE | KEY=VALUE]", "what is finished, stale, failed or missing"),
    "reproduce": ("PAPER", "run what is missing of a paper, then write its report"),
    "show": ("RESULT [FIELD]", "draw the particles of a result, coloured by a field"),
    "animate": ("RESULT [FIELD]", "the same as a moving picture, GIF or MP4"),
    "report": ("RESULTS", "write the report of a folder of results"),
    "choose": ("problem=P error=E", "the cheapest stored run that is good enough, as a command"),
    "compare": ("A B", "what is better or worse in folder B than in A"),
    "merge": ("TARGET A B...", "results of several machines in one folder"),
    "rerun": ("FILE.nc [LIMIT=VALUE...]", "run again from a result file: is the same the result?"),
    "continue": ("FILE.nc end_time=T", "go on from the end of a stored run, with the same bits"),
    "check": ("FILE.py", "does a plug-in keep its contract? a scorecard"),
    "new": ("KIND NAME FOLDER", "a working plug-in or paper to start from, with its test"),
    "export": ("RESULT --vtk|--csv", "particles for ParaView, or everything as CSV"),
    "warmup": ("[KEY=VALUE...]", "compile the kernels that a sweep needs beforehand"),
    "completion": ("bash|zsh", "what a shell has to read so that the tabulator completes words"),
}
