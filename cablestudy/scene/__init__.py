"""The reader of scenes and studies: YAML files -> values in SI.

A value passes through `strict_yaml` (text -> values with places), `document` and `layers` (base files, options),
`fields` and `units` (one value -> SI), `cable_table` and `scene` (the file format); `mistakes` says what is wrong, one
line each. `study`, `entries`, `ranges` and `sampling` say what varies; `schema` describes the format to
editors.
"""
