"""The place where a sample lies, and what makes sure that it is the right one."""
