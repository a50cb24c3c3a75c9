"""What a material can be asked for by: type, text, image, category; and the synthesis that follows the request."""
