"""Many worlds of one town stepped together by several threads."""
