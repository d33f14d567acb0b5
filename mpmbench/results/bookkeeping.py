"""Keys of a configuration that say where, when and how patiently something runs."""

# What does not change a result, so that changing it makes no finished run worthless.
NOT_PART_OF_A_RUN = (
    "output_dir",
    "campaign",
    "limits",
    "on_error",
    "report",
    "rerun",
    "timing",
    "repeats",
)
