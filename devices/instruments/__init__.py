"""Devices of one module each: a module here is a kind of device, named like the module and described by its `KIND`."""
