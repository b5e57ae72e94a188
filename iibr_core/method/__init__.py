"""Inverse image-based rendering in the order of the paper: from the rays of one photo to all views of a light field.

rays (3.1); candidates, smooth_cells, closed_form, ray_transformer, ambiguous_rays, look_up (3.2); occlusion, view,
update_loop (3.3); farthest_views, light_field (3.4). Functions raise Cancelled once the job is stopped.
"""
