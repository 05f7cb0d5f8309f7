"""How the rendered images are painted with OpenCV: the ground, the units, what they do to each other.

Imported only when a client asks for rendered images, because OpenCV takes memory and time to load. Colours are RGB,
images [rows, columns, 3] of bytes with row 0 at the top. `sight.py` decides who sees what; nothing here reads the world
for it. Above: `render.py`.
"""
