"""Background traffic: IDM car following, MOBIL lane changes, junction rules, respawning."""
