"""The version, in one place: the build, the library and the files it writes read it here."""

__version__ = "0.1.0"
