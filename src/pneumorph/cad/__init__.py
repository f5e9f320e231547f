"""What CAD files contain, and Netgen, which reads them and meshes, in a process of its own."""
