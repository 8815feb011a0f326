"""What acts on a body: dead loads, pressures, elastic ties."""
