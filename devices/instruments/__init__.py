"""Kinds of devices with one module each: a module here is named like its kind, which its `KIND` describes."""
