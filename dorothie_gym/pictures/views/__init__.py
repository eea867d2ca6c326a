"""Sessions as people see them: panels, windows, subtitles, films."""
