"""Neural fields: layout, evaluation, batched fitting, the NeuMERL store."""
