"""Studies with people: a study file, participants from consent to completion code, pairing, withdrawal, export."""
