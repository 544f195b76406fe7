"""Studies, group by group, to their tables: stored rows, processes, clusters, selection, comparison."""
