"""What a material is: coordinates, tables, measured files, analytic models, the embedded 100."""
