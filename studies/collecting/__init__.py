"""One database of a lab's sessions, which can always be built again; and which sessions of a study may be used."""
