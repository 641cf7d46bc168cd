"""The body: anthropometry, the chains of tasks, marker sets, and the skeleton."""
