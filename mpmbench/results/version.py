"""The version of what a result file holds, which every file says."""

# Raised when the file gets or changes a variable or an attribute: 2 has the CPU time of the solver,
# the load by others, and a digest; 3 has the energy that is dissipated, pressure and von Mises stress; 4
# has what transfers lose and contact takes, which is no longer in the external work.
SCHEMA_VERSION = 4
KNOWN = (1, 2, 3, 4)  # versions that can be read
SINCE_DIGEST = 2  # the first that has a digest
