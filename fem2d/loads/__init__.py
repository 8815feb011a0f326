"""What acts on a body: dead loads, pressures, muscles, elastic ties."""
