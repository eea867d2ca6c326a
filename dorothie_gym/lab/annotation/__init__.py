"""Annotation of sessions by people: marks, logs, agreement, adjudication, formats, and the tool in the browser."""
