"""Parts of matching and motion transfer: skeleton abstraction, polylines, limbs, feet, headings."""
