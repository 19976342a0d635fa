"""Settings of the kernel that runs the site's pages."""

c = get_config()  # noqa: F821 IPython gives it
c.IPKernelApp.log_level = 40  # it warns of a connection that never leaves this machine
