"""Head and lips as measured on people: landmarks, the two lips, the teeth behind them."""
