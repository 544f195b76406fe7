"""What the user wrote -> plain SI values.

The way of a value: `strict_yaml` (text -> values with places), `document` and `layers` (base files, overrides),
`fields` and `units` (one value -> SI), `tables`, `cable_table` and `scene` (the file format), `mistakes` (what is wrong
-> one line each). `study` and `ranges` say what varies; `schema` tells editors about all of it.
"""
